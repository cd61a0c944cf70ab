"""Pictures of fits, samples, searches and wear."""
