"""What a material is: recipe, masks, looks of substances, survey of the mesh, residual."""
