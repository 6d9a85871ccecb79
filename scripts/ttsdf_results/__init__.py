"""The project's figures: what is measured (scenes, methods, steps), and the pages and pictures made from it."""
