"""Before any search: what of the declarations and of the samples cannot be taken as it stands."""
