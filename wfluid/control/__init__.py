"""Control of the whole simulation: objectives, their exact gradients, and what they are gradients by."""
