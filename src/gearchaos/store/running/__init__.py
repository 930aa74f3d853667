"""Runs into a store: created or continued, computed by workers, finished."""
