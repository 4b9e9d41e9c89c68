"""Reading recorded bags, finished or not: what lies in them, runs, and long runs in blocks."""
