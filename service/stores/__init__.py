"""Reading and writing of what the database holds, one module for each kind."""
