"""Campaigns: a study runs its cases, judges its claims and leaves a record that anyone can check."""
