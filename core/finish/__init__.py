"""From values to images: margins, pictures, files, reports, comparisons."""
