//! Statistics of errors, coverage and views.
