"""What a person writes about a scene, checked and filled in, and the compiled model it stands for."""
