//! Tests by question.
