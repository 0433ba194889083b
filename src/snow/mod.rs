//! A deep layer of snow that objects move through (thesis chapter 3).
