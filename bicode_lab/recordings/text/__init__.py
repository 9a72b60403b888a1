"""Read event files of lines: CSV with a header, the vendor's CSV, and text of four numbers a line."""
