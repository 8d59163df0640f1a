//! The people in a frame.

use messages::{MAX_PEOPLE, NO_CANDIDATE, People, PersonMessage, Status};
use pipeline::{FramePeople, KnownPerson};

use crate::WireError;
use crate::error::{count, equal, index};

/// Writes the people in a frame. The caller fills in stamp and timing.
///
/// * `views_present`: bit `v` is set if view `v` delivered candidates in time.
///
/// # Errors
///
/// Returns a [`WireError`] if there are too many people, views or candidates.
pub fn people_to_message(frame: &FramePeople, views_present: u32) -> Result<People, WireError> {
    let n_people = count("n_people", frame.people.len(), MAX_PEOPLE)?;
    let mut message = People {
        status: if n_people == 0 {
            Status::NO_DETECTION
        } else {
            Status::OK
        },
        n_people: n_people as u32,
        n_seen: frame.n_seen as u32,
        views_present,
        ..People::default()
    };
    for (slot, person) in message.people.iter_mut().zip(&frame.people) {
        *slot = person_to_message(person)?;
    }
    Ok(message)
}

fn person_to_message(person: &KnownPerson) -> Result<PersonMessage, WireError> {
    let mut message = PersonMessage {
        id: person.id,
        candidates: [NO_CANDIDATE; messages::MAX_VIEWS],
    };
    count("views", person.candidates.len(), messages::MAX_VIEWS)?;
    for (view, candidate) in person.candidates.iter().enumerate() {
        if let Some(candidate) = candidate {
            index("candidates", view, *candidate, messages::MAX_CANDIDATES)?;
            message.candidates[view] = *candidate as u8;
        }
    }
    Ok(message)
}

/// Reads the people in a frame.
///
/// * `n_views`: number of views of the rig.
///
/// # Errors
///
/// Returns a [`WireError`] in these cases:
///
/// * There are too many people, a person has no id, or two people have the same id or the same candidate.
/// * The index of a candidate is too large, or the candidate belongs to a view that is not in the rig.
pub fn people_from_message(message: &People, n_views: usize) -> Result<FramePeople, WireError> {
    let n = count("n_people", message.n_people as usize, MAX_PEOPLE)?;
    let mut people: Vec<KnownPerson> = Vec::with_capacity(n);
    for (entry, it) in message.people[..n].iter().enumerate() {
        let mut candidates = vec![None; n_views];
        for (view, candidate) in it.candidates.into_iter().enumerate() {
            if candidate == NO_CANDIDATE {
                continue;
            }
            index("view of a candidate", entry, view, n_views)?;
            let limit = messages::MAX_CANDIDATES;
            let candidate = index("candidates", view, usize::from(candidate), limit)?;
            let is_taken = people.iter().any(|other| other.candidates[view] == Some(candidate));
            equal("people of a candidate", 1 + usize::from(is_taken), 1)?;
            candidates[view] = Some(candidate);
        }
        let is_known = people.iter().any(|other| other.id == it.id);
        equal("people of an identity", 1 + usize::from(is_known), 1)?;
        equal("people without an identity", usize::from(it.id == 0), 0)?;
        people.push(KnownPerson {
            id: it.id,
            candidates,
        });
    }
    Ok(FramePeople {
        people,
        n_seen: message.n_seen as usize,
    })
}

#[cfg(test)]
mod tests {
    use messages::MAX_VIEWS;
    use proptest::prelude::*;

    use super::*;

    fn person(id: u64, candidates: &[Option<usize>]) -> KnownPerson {
        KnownPerson {
            id,
            candidates: candidates.to_vec(),
        }
    }

    fn frame() -> FramePeople {
        FramePeople {
            people: vec![
                person(3, &[Some(1), None, Some(0)]),
                person(7, &[Some(0), None, Some(2)]),
            ],
            n_seen: 4,
        }
    }

    #[test]
    fn people_survive_a_round_trip() {
        let message = people_to_message(&frame(), 0b101).unwrap();
        assert_eq!((message.status, message.views_present), (Status::OK, 0b101));
        assert_eq!(people_from_message(&message, 3).unwrap(), frame());
        let nobody = people_to_message(&FramePeople::default(), 0).unwrap();
        assert_eq!(nobody.status, Status::NO_DETECTION);
        assert_eq!(
            people_from_message(&nobody, 3).unwrap(),
            FramePeople::default()
        );
    }

    #[test]
    fn a_candidate_belongs_to_one_person_and_ids_are_unique() {
        let good = people_to_message(&frame(), 0b101).unwrap();
        let refused = |change: fn(&mut People)| {
            let mut message = good;
            change(&mut message);
            people_from_message(&message, 3).unwrap_err().to_string()
        };
        let got = refused(|message| message.people[1].candidates[0] = 1);
        assert_eq!(got, "people of a candidate is 2, expected 1");
        let got = refused(|message| message.people[1].id = 3);
        assert_eq!(got, "people of an identity is 2, expected 1");
        let got = refused(|message| message.people[0].candidates[3] = 0);
        assert_eq!(
            got,
            "view of a candidate of entry 0 is 3, but the limit is 3"
        );
        let ninth = FramePeople {
            people: vec![person(1, &[Some(8)])],
            n_seen: 1,
        };
        people_to_message(&ninth, 0).unwrap_err();
    }

    proptest! {
        #[test]
        fn any_message_is_refused_or_names_possible_candidates(
            n_people in prop_oneof![9 => 0_u32..9, 1 => any::<u32>()],
            choices in prop::array::uniform8(prop::array::uniform4((0_u8..60, any::<u8>()))),
        ) {
            let mut message = People { n_people, ..People::default() };
            for (nth, (slot, choices)) in message.people.iter_mut().zip(choices).enumerate() {
                // Most people have a candidate of their own, or none, and none in the fourth view, which does not exist.
                let mut candidates = [NO_CANDIDATE; MAX_VIEWS];
                for (view, (kind, value)) in choices.into_iter().enumerate() {
                    candidates[view] = match kind {
                        0 => value,
                        1..40 if view < 3 => nth as u8,
                        _ => NO_CANDIDATE,
                    };
                }
                *slot = PersonMessage { id: nth as u64 + 1, candidates };
            }
            if let Ok(frame) = people_from_message(&message, 3) {
                for person in &frame.people {
                    prop_assert_eq!(person.candidates.len(), 3);
                    prop_assert!(person.candidates.iter().flatten().all(|candidate| *candidate < messages::MAX_CANDIDATES));
                }
            }
        }
    }
}
