"""Pages and tables that present the results of the study."""
