//! XML form of an `OpenCV` storage.

use std::collections::BTreeMap;

use roxmltree::{Document, Node};

use super::Entry;
use crate::files::ParseError;

/// Reads the elements below the root.
pub(super) fn parse(text: &str) -> Result<BTreeMap<String, Entry>, ParseError> {
    let document = Document::parse(text).map_err(|error| ParseError::Syntax {
        format: "XML",
        source: Box::new(error),
    })?;
    let elements = document.root_element().children().filter(Node::is_element);
    let named = elements.map(|node| (node.tag_name().name().to_owned(), entry(node, true)));
    Ok(named.collect())
}

/// Converts an element.
///
/// * `is_top`: true for an element below the root; its child elements are either named entries or a list of `_` elements.
fn entry(node: Node<'_, '_>, is_top: bool) -> Entry {
    let children: Vec<Node<'_, '_>> = node.children().filter(Node::is_element).collect();
    if is_top && !children.is_empty() {
        if children.iter().all(|child| child.tag_name().name() == "_") {
            return Entry::List(children.into_iter().map(|child| entry(child, false)).collect());
        }
        let named = children.into_iter().map(|child| {
            let name = child.tag_name().name().to_owned();
            let value = match &*name {
                "data" => numbers(child),
                _ => entry(child, false),
            };
            (name, value)
        });
        return Entry::Map(named.collect());
    }
    let text = node.text().unwrap_or_default().trim();
    if text.is_empty() {
        return Entry::Nothing;
    }
    text.parse().map_or_else(
        |_not_a_number| Entry::Text(text.trim_matches('"').to_owned()),
        Entry::Number,
    )
}

fn numbers(node: Node<'_, '_>) -> Entry {
    let words = node.text().unwrap_or_default().split_whitespace();
    let number =
        |word: &str| word.parse().map_or_else(|_| Entry::Text(word.to_owned()), Entry::Number);
    Entry::List(words.map(number).collect())
}
