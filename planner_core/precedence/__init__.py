"""What may follow what among a satellite's tasks, and longest paths over it."""
