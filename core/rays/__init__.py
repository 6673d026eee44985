"""Rays: the kernel and Embree, what occludes, what a map asks of its rays, what is summed up of them."""
