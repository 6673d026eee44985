"""What materials' nodes say of opacity and normals."""
