"""Plans with a life: what is stored of them, and where they may go."""
