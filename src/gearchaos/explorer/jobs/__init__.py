"""What is computed for a page: in which order, by which thread and process, and how it is cancelled."""
