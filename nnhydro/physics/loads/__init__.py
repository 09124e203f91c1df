"""Load terms, one law a file; being here is the whole registration."""
