"""The report of a store: figures declared once, drawn by a page, by Markdown and by Matplotlib."""
