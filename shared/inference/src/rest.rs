//! Writes a file with the part of a network that comes after the front.

use std::collections::HashSet;

use crate::onnx::Message;

use crate::front::Front;
use crate::nesting::varint;
use crate::source::Source;

/// Field numbers in a file and in its graph.
const GRAPH: u64 = 7;
const NODE: u64 = 1;
const CONSTANT: u64 = 5;
const INPUT: u64 = 11;
const VALUE_INFO: u64 = 13;
/// Element type of single precision.
const FLOAT: i64 = 1;

/// A field of a message.
struct Field<'a> {
    number: u64,
    /// The whole field, including its number and length.
    whole: &'a [u8],
    content: &'a [u8],
}

/// Returns the file without the front: the outputs of the front become additional inputs. Returns `None` if there is nothing after the
/// front.
///
/// * `file`: bytes of a file whose nesting has been checked.
pub(crate) fn rest(file: &[u8], source: &Source, front: &Front) -> Option<Vec<u8>> {
    if front.behind.is_empty() {
        return None;
    }
    let mut rest = Vec::new();
    for field in fields(file)? {
        if field.number == GRAPH {
            let graph = graph(field.content, source, front)?;
            rest.extend(Message::default().bytes(GRAPH, &graph).finish());
        } else {
            rest.extend(field.whole);
        }
    }
    Some(rest)
}

fn graph(bytes: &[u8], source: &Source, front: &Front) -> Option<Vec<u8>> {
    let nodes = source.graph.node.iter().enumerate();
    let kept = nodes.filter(|(at, _)| front.behind.contains(at));
    let taken: HashSet<&str> =
        kept.flat_map(|(_, node)| node.input.iter().map(String::as_str)).collect();
    let (mut n_nodes, mut n_constants) = (0, 0);
    let mut graph = Vec::new();
    for field in fields(bytes)? {
        let is_kept = match field.number {
            NODE => {
                n_nodes += 1;
                front.behind.contains(&(n_nodes - 1))
            }
            CONSTANT => {
                n_constants += 1;
                let constant = source.graph.initializer.get(n_constants - 1)?;
                taken.contains(constant.name.as_deref()?)
            }
            // The descriptions of intermediate values are left out, because they may refer to removed values.
            VALUE_INFO => false,
            _ => true,
        };
        if is_kept {
            graph.extend(field.whole);
        }
    }
    for exit in &front.exits {
        let side = |side: usize| Message::default().number(1, side as i64);
        let sides = [1].into_iter().chain(front.sides[exit.value.stack]);
        let shape = Message::default().each(sides, |shape, it| shape.message(1, &side(it)));
        let tensor = Message::default().number(1, FLOAT).message(2, &shape);
        let kind = Message::default().message(1, &tensor);
        let input = Message::default().text(1, &exit.name).message(2, &kind);
        graph.extend(Message::default().message(INPUT, &input).finish());
    }
    Some(graph)
}

fn fields(bytes: &[u8]) -> Option<Vec<Field<'_>>> {
    let mut all = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let begin = at;
        let tag = varint(bytes, &mut at)?;
        let length = match tag & 7 {
            0 => varint(bytes, &mut at).map(|_| 0)?,
            1 => 8,
            2 => usize::try_from(varint(bytes, &mut at)?).ok()?,
            5 => 4,
            _ => return None,
        };
        let end = at.checked_add(length)?;
        all.push(Field {
            number: tag >> 3,
            whole: bytes.get(begin..end)?,
            content: &bytes[at..end],
        });
        at = end;
    }
    Some(all)
}
