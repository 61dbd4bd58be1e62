"""What an asset folder is: its files and their writers; export to other programs; report.html."""
