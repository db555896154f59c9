"""razy-check: an independent proof, in ball arithmetic, of the periodic motions of razy-follow (docs/check.md)."""
