"""Who may call the service, how often, and the record of what they changed."""
