"""Plans whose collects start when it suits: insertion, and a search over windows of the plan."""
