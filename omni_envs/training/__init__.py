"""Training: adapters to the trainers, the recipe, evaluation."""
