//! Zhang's closed form.
