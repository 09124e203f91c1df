"""Cards and pictures of effects, and the table of what a campaign would reveal."""
