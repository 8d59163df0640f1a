//! The operations of networks, recorded for the backward pass.

use super::record::{At, Record};
use crate::networks::ops::{Conv, Ops, Places, Scaling};

impl Ops for Record<'_> {
    type Value = At;

    fn input(&mut self, name: &'static str) -> At {
        let (dims, values) = self.shown(name);
        self.record(dims, values, None)
    }

    fn centred(&mut self, list: &At, name: &str) -> At {
        self.centre(*list, name)
    }

    fn conv(&mut self, map: &At, name: &str, conv: Conv) -> At {
        let convolved = self.convolve(*map, name, conv);
        if conv.scaling == Scaling::Batch {
            self.normalise(convolved, name)
        } else {
            convolved
        }
    }

    fn relu(&mut self, value: &At) -> At {
        self.positive(*value)
    }

    fn add(&mut self, a: &At, b: &At) -> At {
        self.sum(*a, *b)
    }

    fn doubled(&mut self, map: &At) -> At {
        self.double(*map)
    }

    fn pool(&mut self, map: &At) -> At {
        self.pool_pairs(*map)
    }

    fn mean(&mut self, map: &At) -> At {
        self.average(*map)
    }

    fn highest(&mut self, map: &At) -> At {
        self.maximum(*map)
    }

    fn flat(&mut self, map: &At) -> At {
        let flat = (vec![self.size(*map)], self.take(*map));
        self.derived(*map, flat, |_, gradient| gradient.to_vec())
    }

    fn fixed(&mut self, value: &At) -> At {
        self.record(self.dims(*value).to_vec(), self.take(*value), None)
    }

    fn softmax(&mut self, maps: &At, sharpness: f32) -> At {
        self.soften(*maps, sharpness)
    }

    fn around(&mut self, list: &At, like: &At, places: &Places) -> At {
        self.gaussians(*list, *like, places)
    }

    fn look(&mut self, map: &At, weights: &At) -> At {
        self.look_by(*map, *weights)
    }

    fn place(&mut self, weights: &At) -> At {
        self.places(*weights)
    }

    fn join(&mut self, lists: &[&At]) -> At {
        let lists: Vec<At> = lists.iter().map(|list| **list).collect();
        self.concatenate(&lists)
    }

    fn dense(&mut self, list: &At, name: &str, values: usize) -> At {
        self.connect(*list, name, values)
    }

    fn prelu(&mut self, list: &At, name: &str) -> At {
        self.slope(*list, name)
    }

    fn dropout(&mut self, list: &At, share: f32) -> At {
        self.drop_out(*list, share)
    }
}
