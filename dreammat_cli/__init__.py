"""The command line: parse, call a stage, echo. Knows no numerics."""
