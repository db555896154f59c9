"""The page of razy-view."""
