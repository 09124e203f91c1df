"""The public Python interface: what the guide shows. Results print themselves, as text and in notebooks, and turn into data frames."""
