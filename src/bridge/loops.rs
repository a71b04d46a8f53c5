//! Openings of a shell: the parts of its rims that nothing covers, joined to loops.
//!
//! In:         the rim edges of one shell with the share of each that is covered.
//! Out:        [`Opening`]s: closed loops, of open rim edges alone where they close by themselves;
//!             else closed over what covers the rest.
//! Invariant:  every open rim edge is in one loop; the loops depend on the edges and their order
//!             alone.
//! Units:      model units.
//! Memory:     the rims of one shell, at most [`MOST_RIMS`].

use std::collections::HashMap;

use glam::DVec3;

use crate::bridge::rims::RimEdge;
use crate::bridge::shells::Cover;

/// Rim edges of one shell beyond which it is left to the patch.
pub const MOST_RIMS: usize = 1 << 16;

/// More loose ends than this are joined to the ends of their own chains without a search.
const MOST_LOOSE_ENDS: usize = 1024;

/// A rim edge of a shell.
#[derive(Clone, Copy, Debug)]
pub struct ShellRim {
    pub edge: RimEdge,
    /// Its ends on the lattice, packed.
    pub ends: [u128; 2],
    pub cover: Cover,
}

impl ShellRim {
    /// Whether no other rim faces most of it.
    pub fn is_open(&self) -> bool {
        self.cover.faced < 0.5
    }

    /// Length that no other rim faces.
    pub fn open_length(&self) -> f64 {
        self.edge.length() * (1.0 - self.cover.faced)
    }
}

/// A step along a loop: a rim edge, and whether the loop runs along it from its second end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    pub rim: usize,
    pub backward: bool,
}

/// A loop of open rim edges.
#[derive(Clone, Debug, Default)]
pub struct Opening {
    pub steps: Vec<Step>,
    /// Widest jump between the end of one edge and the begin of the next, model units.
    pub widest_jump: f64,
}

impl Opening {
    /// The begin of each edge.
    pub fn points(&self, rims: &[ShellRim]) -> Vec<DVec3> {
        self.steps.iter().map(|step| end_of(&rims[step.rim], step.backward)).collect()
    }

    /// The share of its length that ends on faces or lies on them; and that lies.
    pub fn held(&self, rims: &[ShellRim]) -> [f64; 2] {
        let [mut length, mut held, mut lying] = [0.0; 3];
        for step in &self.steps {
            let rim = &rims[step.rim];
            length += rim.edge.length();
            held += rim.edge.length() * (rim.cover.on_face + rim.cover.lying);
            lying += rim.edge.length() * rim.cover.lying;
        }
        [held, lying].map(|part| part / length.max(f64::MIN_POSITIVE))
    }

    /// The share of its length that panes are beside.
    pub fn glazed(&self, rims: &[ShellRim]) -> f64 {
        let sum = |weight: fn(&ShellRim) -> f64| -> f64 {
            self.steps
                .iter()
                .map(|step| rims[step.rim].edge.length() * weight(&rims[step.rim]))
                .sum()
        };
        sum(|rim| rim.cover.glazed) / sum(|_| 1.0).max(f64::MIN_POSITIVE)
    }

    /// Area of the fan from the middle of the loop: not less than that of a flat fill.
    pub fn area(&self, rims: &[ShellRim]) -> f64 {
        let ends = |step: &Step| {
            let [begin, end] = [step.backward, !step.backward];
            [end_of(&rims[step.rim], begin), end_of(&rims[step.rim], end)]
        };
        let count = self.steps.len().max(1) as f64;
        let middle = self.points(rims).iter().sum::<DVec3>() / count;
        let mut area = 0.0;
        for (i, step) in self.steps.iter().enumerate() {
            let [begin, end] = ends(step);
            let [next, _] = ends(&self.steps[(i + 1) % self.steps.len()]);
            area += 0.5 * (begin - middle).cross(end - middle).length();
            area += 0.5 * (end - middle).cross(next - middle).length();
        }
        area
    }
}

fn end_of(rim: &ShellRim, is_second: bool) -> DVec3 {
    rim.edge.ends()[usize::from(is_second)]
}

/// Joins the open ones among `rims` to loops.
pub fn trace(rims: &[ShellRim]) -> Vec<Opening> {
    let mut at: HashMap<u128, Vec<usize>> = HashMap::new();
    let open: Vec<usize> = (0..rims.len()).filter(|&i| rims[i].is_open()).collect();
    for &i in &open {
        rims[i].ends.iter().for_each(|&end| at.entry(end).or_default().push(i));
    }
    let mut tracer = Tracer { rims, at, used: vec![false; rims.len()] };
    let mut chains = Vec::new();
    let mut loops = Vec::new();
    // Chains with ends first: begun in their middle they would be two.
    let is_end = |tracer: &Tracer, i: usize| {
        rims[i].ends.iter().position(|end| tracer.at[end].len() % 2 == 1)
    };
    for &i in &open {
        if let Some(end) = is_end(&tracer, i)
            && !tracer.used[i]
        {
            tracer.walk(Step { rim: i, backward: end == 1 }, &mut chains, &mut loops);
        }
    }
    for &i in &open {
        if !tracer.used[i] {
            tracer.walk(Step { rim: i, backward: false }, &mut chains, &mut loops);
        }
    }
    let closed = loops.into_iter().map(|steps| Opening { steps, widest_jump: 0.0 });
    closed.chain(close_chains(rims, chains)).collect()
}

struct Tracer<'t> {
    rims: &'t [ShellRim],
    at: HashMap<u128, Vec<usize>>,
    used: Vec<bool>,
}

impl Tracer<'_> {
    /// Walks from an edge until it finds no way on; loops on the way are split off.
    fn walk(&mut self, first: Step, chains: &mut Vec<Vec<Step>>, loops: &mut Vec<Vec<Step>>) {
        let mut path: Vec<Step> = Vec::new();
        let mut seen: HashMap<u128, usize> = HashMap::new();
        let mut next = Some(first);
        while let Some(step) = next {
            self.used[step.rim] = true;
            let [begin, end] = self.ends(step);
            seen.insert(begin, path.len());
            path.push(step);
            if let Some(&from) = seen.get(&end) {
                let ring = path.split_off(from);
                for step in &ring {
                    seen.remove(&self.ends(*step)[0]);
                }
                loops.push(ring);
            }
            next = self.way_on(step, end);
        }
        if !path.is_empty() {
            chains.push(path);
        }
    }

    fn ends(&self, step: Step) -> [u128; 2] {
        let [a, b] = self.rims[step.rim].ends;
        if step.backward { [b, a] } else { [a, b] }
    }

    /// The next edge at `end`: of the same sheet and in the same sense where there is a choice.
    fn way_on(&self, from: Step, end: u128) -> Option<Step> {
        let sheet = self.rims[from.rim].edge.sheet;
        let ways = self.at[&end].iter().filter(|&&i| !self.used[i]);
        let steps = ways.map(|&rim| Step { rim, backward: self.rims[rim].ends[0] != end });
        steps.min_by_key(|step| {
            let is_other = self.rims[step.rim].edge.sheet != sheet;
            (is_other, step.backward != from.backward, step.rim)
        })
    }
}

/// Joins chains at their loose ends, the nearest first.
fn close_chains(rims: &[ShellRim], chains: Vec<Vec<Step>>) -> Vec<Opening> {
    let ends: Vec<[DVec3; 2]> = chains
        .iter()
        .map(|chain| {
            let (first, last) = (chain[0], chain[chain.len() - 1]);
            [end_of(&rims[first.rim], first.backward), end_of(&rims[last.rim], !last.backward)]
        })
        .collect();
    // Of loose end 2i or 2i + 1 of chain i, the one that it is joined to.
    let mut mates: Vec<usize> = (0..2 * chains.len()).map(|end| end ^ 1).collect();
    if mates.len() <= MOST_LOOSE_ENDS {
        mates = nearest_mates(&ends);
    }
    let mut openings = Vec::new();
    let mut used = vec![false; chains.len()];
    for start in 0..chains.len() {
        let mut opening = Opening::default();
        let (mut chain, mut enters_at) = (start, 0);
        while !used[chain] {
            used[chain] = true;
            let steps = chains[chain].iter().copied();
            if enters_at == 0 {
                opening.steps.extend(steps);
            } else {
                let turned = |s: Step| Step { backward: !s.backward, ..s };
                opening.steps.extend(steps.rev().map(turned));
            }
            let leaves = 2 * chain + (1 - enters_at);
            let mate = mates[leaves];
            let jump = ends[chain][1 - enters_at].distance(ends[mate / 2][mate % 2]);
            opening.widest_jump = opening.widest_jump.max(jump);
            (chain, enters_at) = (mate / 2, mate % 2);
        }
        if !opening.steps.is_empty() {
            openings.push(opening);
        }
    }
    openings
}

/// Pairs loose ends, nearest pairs first. Both ends of one chain may be a pair.
fn nearest_mates(ends: &[[DVec3; 2]]) -> Vec<usize> {
    let place = |end: usize| ends[end / 2][end % 2];
    let count = 2 * ends.len();
    let mut pairs: Vec<(f64, usize, usize)> = Vec::with_capacity(count * count / 2);
    for a in 0..count {
        pairs.extend((a + 1..count).map(|b| (place(a).distance_squared(place(b)), a, b)));
    }
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut mates = vec![usize::MAX; count];
    for (_, a, b) in pairs {
        if mates[a] == usize::MAX && mates[b] == usize::MAX {
            (mates[a], mates[b]) = (b, a);
        }
    }
    mates
}
