"""Many jobs: the file that lists them, what they cost, what became of them; to run them is an engine's work (`workflow/`)."""
