"""Commands that write results for other programs, merge, import, and say what is installed."""
