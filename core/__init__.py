"""Occlusion per texel, in numpy and a native kernel. Nothing here imports bpy."""
