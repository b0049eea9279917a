"""The hard cases: where elements, steps and solvers break, chapter by chapter, against values known otherwise.

A chapter is a module with `TITLE`, `units(budget)` (what to run, see `chapter.Asked`) and
`present(outcomes)` (what it shows, a `chapter.Chapter`). `study` runs them and writes the page.
"""
