"""Reports: a manifest of cases, pictures and numbers becomes one page that says what agrees and what does not."""
