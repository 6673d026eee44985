#!/usr/bin/env bash
# What the items of a manifest came to, once all tasks have ended. submit.sh hands it in.
exec "${BLENDER:-blender}" --background --command occlusion_bake merge "$1"
