"""The documentation: its pages, and programs that build the site and write numbers into pages."""
