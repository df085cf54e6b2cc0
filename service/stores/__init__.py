"""Reading and writing of the database, one module for each kind of content."""
