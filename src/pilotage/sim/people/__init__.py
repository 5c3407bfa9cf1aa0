"""Who moves about besides the robots: a file for each plan, and what comes of meeting them."""
