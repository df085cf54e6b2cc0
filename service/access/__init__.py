"""Who may call the service and how often, and the record of changes."""
