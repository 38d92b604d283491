"""The equations of the model: one contact plane, the critical state, the planes together."""
