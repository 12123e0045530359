//! Object checklists (Wortel 2011, section 3.5.2): lists of objects that a future update must look at,
//! since no bound on their steps says that they are still where they belong. A ring of lists, one an
//! update ahead. It must not know where objects are.

use crate::part::ObjectId;

/// Updates ahead that have a list. Who need not be looked at for longer is looked at then.
const AHEAD: u32 = 256;
/// Not to be looked at.
const NEVER: u32 = u32::MAX;

/// The lists, and when each object is due.
#[derive(Clone, Debug)]
pub(super) struct Checklists {
    /// By update, modulo [`AHEAD`]. An object in a list that it is not due by is passed over.
    lists: Vec<Vec<ObjectId>>,
    due: Vec<u32>,
    /// The update that is under way or was last.
    now: u32,
}

impl Checklists {
    /// Nobody is due.
    pub(super) fn new(count: usize) -> Self {
        Self { lists: vec![Vec::new(); AHEAD as usize], due: vec![NEVER; count], now: 0 }
    }

    /// Begins the next update: who is to be looked at in it. Give the list back to
    /// [`Checklists::recycle`].
    pub(super) fn next(&mut self) -> Vec<ObjectId> {
        self.now += 1;
        let mut list = std::mem::take(&mut self.lists[(self.now % AHEAD) as usize]);
        list.retain(|id| self.due[id.0 as usize] == self.now);
        list
    }

    /// Takes the memory of a list back.
    pub(super) fn recycle(&mut self, mut list: Vec<ObjectId>) {
        list.clear();
        let place = &mut self.lists[(self.now % AHEAD) as usize];
        if place.capacity() < list.capacity() {
            // What was put there meanwhile is due in a whole round.
            list.append(place);
            *place = list;
        }
    }

    /// The object may have left its place once it is farther than `distance` from where it is now and goes
    /// at most `step` a frame; neither is negative. It is looked at before that.
    pub(super) fn put(&mut self, id: ObjectId, distance: f64, step: f64) {
        let due = &mut self.due[id.0 as usize];
        if step <= 0.0 {
            *due = NEVER;
            return;
        }
        // After k updates it has gone k steps: k is rounded down, and the quotient errs by half a unit in
        // the last place, far less than the part taken off.
        let whole = (distance / step * (1.0 - 1e-9)).clamp(0.0, f64::from(AHEAD - 2)) as u32;
        *due = self.now + whole + 1;
        self.lists[(*due % AHEAD) as usize].push(id);
    }

    /// It is looked at in the next update.
    pub(super) fn put_next(&mut self, id: ObjectId) {
        let due = &mut self.due[id.0 as usize];
        if *due != self.now + 1 {
            *due = self.now + 1;
            self.lists[(*due % AHEAD) as usize].push(id);
        }
    }

    /// Updates until the object is looked at, from 1; `None` for never.
    pub(super) fn ahead(&self, id: ObjectId) -> Option<u32> {
        let due = self.due[id.0 as usize];
        (due != NEVER).then(|| due - self.now)
    }

    /// Bytes on the heap.
    pub(super) fn heap_bytes(&self) -> usize {
        let lists: usize = self.lists.iter().map(|list| list.capacity() * 4).sum();
        self.lists.capacity() * size_of::<Vec<ObjectId>>() + lists + self.due.capacity() * 4
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Who goes a step each update is looked at before it can be farther than it was said.
    #[test]
    fn nobody_is_looked_at_too_late() {
        for (distance, step) in [(0.0, 1.0), (0.9, 1.0), (1.0, 1.0), (10.0, 0.3), (1e9, 0.5)] {
            let mut lists = Checklists::new(2);
            lists.put(ObjectId(1), distance, step);
            let ahead = lists.ahead(ObjectId(1)).unwrap();
            assert!(f64::from(ahead - 1) * step <= distance, "{distance} {step}");
            assert!(f64::from(ahead + 1) * step > distance || ahead == AHEAD - 1);
            for update in 1..=ahead {
                let list = lists.next();
                assert_eq!(list.len(), usize::from(update == ahead), "{distance} {step} {update}");
                lists.recycle(list);
            }
        }
    }

    #[test]
    fn the_last_word_counts() {
        let mut lists = Checklists::new(1);
        lists.put(ObjectId(0), 5.0, 1.0);
        lists.put_next(ObjectId(0));
        lists.put_next(ObjectId(0));
        assert_eq!(lists.next(), [ObjectId(0)]);
        lists.put(ObjectId(0), 3.0, 0.0);
        assert_eq!(lists.ahead(ObjectId(0)), None);
        for _ in 0..2 * AHEAD {
            assert!(lists.next().is_empty(), "who stands still is not looked at");
        }
    }
}
