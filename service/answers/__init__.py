"""Answers of jobs: rendered from judged plans, stored in blocks, read back, and rebuilt."""
