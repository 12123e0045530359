//! Object checklists (Wortel 2011, section 3.5.2): lists of objects that a future update must look at,
//! since no bound on their steps says that they are still where they belong. A ring of lists, one an
//! update ahead. It must not know where objects are.

use crate::part::ObjectId;

/// Not to be looked at.
const NEVER: u32 = u32::MAX;

/// The update by which an object is to be looked at; kept with what else is known of the object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Due(u32);

impl Due {
    /// Not at all.
    pub(super) const NEVER: Self = Self(NEVER);
}

/// The lists.
#[derive(Clone, Debug)]
pub(super) struct Checklists {
    /// By update, modulo how many there are. An object in a list that it is not due by is passed over.
    lists: Vec<Vec<ObjectId>>,
    /// The update that is under way or was last.
    now: u32,
}

impl Checklists {
    /// Nobody is due. There are lists for so many updates ahead, at least 3; who need not be looked at for
    /// longer is looked at then.
    pub(super) fn new(ahead: u32) -> Self {
        Self { lists: vec![Vec::new(); ahead as usize], now: 0 }
    }

    fn list(&mut self, update: u32) -> &mut Vec<ObjectId> {
        let place = update as usize % self.lists.len();
        &mut self.lists[place]
    }

    /// Begins the next update: who may have to be looked at in it, of whom [`Checklists::is_due`] says
    /// whether. Give the list back to [`Checklists::recycle`].
    pub(super) fn next(&mut self) -> Vec<ObjectId> {
        self.now += 1;
        std::mem::take(self.list(self.now))
    }

    /// Whether the object is to be looked at in this update.
    pub(super) fn is_due(&self, due: Due) -> bool {
        due.0 == self.now
    }

    /// Takes the memory of a list back.
    pub(super) fn recycle(&mut self, mut list: Vec<ObjectId>) {
        let place = self.list(self.now);
        // Nobody is due a whole round ahead.
        debug_assert!(place.is_empty());
        list.clear();
        *place = list;
    }

    /// The object may have left its place once it is farther than `distance` from where it is now and goes
    /// at most `step` a frame; neither is negative. It is looked at before that.
    pub(super) fn put(&mut self, id: ObjectId, due: &mut Due, distance: f64, step: f64) {
        if step <= 0.0 {
            *due = Due::NEVER;
            return;
        }
        // After k updates it has gone k steps: k is rounded down, and the quotient errs by half a unit in
        // the last place, far less than the part taken off.
        let whole =
            (distance / step * (1.0 - 1e-9)).clamp(0.0, (self.lists.len() - 2) as f64) as u32;
        *due = Due(self.now + whole + 1);
        self.list(due.0).push(id);
    }

    /// It is looked at in the next update.
    pub(super) fn put_next(&mut self, id: ObjectId, due: &mut Due) {
        if due.0 != self.now + 1 {
            *due = Due(self.now + 1);
            self.list(due.0).push(id);
        }
    }

    /// Whether the object is in the list of the update that it is due by, and due in time: it is `distance`
    /// from where it may leave its place, goes at most `step` a frame, and neither may be off by more than
    /// `rounding`. To be asked between updates.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub(super) fn check(
        &self,
        (id, due): (ObjectId, Due),
        (distance, step, rounding): (f64, f64, f64),
    ) -> Result<(), String> {
        if step <= 0.0 {
            return Ok(());
        }
        let Due(update) = due;
        let ahead = self.lists.len() as u32;
        if update <= self.now || update - self.now >= ahead {
            return Err(format!("object {} is due by no update to come", id.0));
        }
        if !self.lists[(update % ahead) as usize].contains(&id) {
            return Err(format!("object {} is not in the list that it is due by", id.0));
        }
        // It is looked at after the updates before that one have passed.
        let unseen = f64::from(update - self.now - 1) * step;
        if unseen > distance.max(0.0) + rounding {
            return Err(format!("object {} may leave its place before it is looked at", id.0));
        }
        Ok(())
    }

    /// Bytes on the heap.
    pub(super) fn heap_bytes(&self) -> usize {
        let lists: usize = self.lists.iter().map(|list| list.capacity() * 4).sum();
        self.lists.capacity() * size_of::<Vec<ObjectId>>() + lists
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AHEAD: u32 = 256;

    /// Who goes a step each update is looked at before it can be farther than it was said.
    #[test]
    fn nobody_is_looked_at_too_late() {
        for (distance, step) in [(0.0, 1.0), (0.9, 1.0), (1.0, 1.0), (10.0, 0.3), (1e9, 0.5)] {
            let (mut lists, mut due) = (Checklists::new(AHEAD), Due::NEVER);
            lists.put(ObjectId(1), &mut due, distance, step);
            let ahead = due.0;
            assert!(f64::from(ahead - 1) * step <= distance, "{distance} {step}");
            assert!(f64::from(ahead + 1) * step > distance || ahead == AHEAD - 1);
            for update in 1..=ahead {
                let list = lists.next();
                let looked_at = list.iter().filter(|_| lists.is_due(due)).count();
                assert_eq!(looked_at, usize::from(update == ahead), "{distance} {step} {update}");
                lists.recycle(list);
            }
        }
    }

    #[test]
    fn the_last_word_counts() {
        let (mut lists, mut due) = (Checklists::new(AHEAD), Due::NEVER);
        lists.put(ObjectId(0), &mut due, 5.0, 1.0);
        lists.put_next(ObjectId(0), &mut due);
        lists.put_next(ObjectId(0), &mut due);
        assert_eq!(lists.next(), [ObjectId(0)]);
        assert!(lists.is_due(due));
        lists.put(ObjectId(0), &mut due, 3.0, 0.0);
        assert_eq!(due, Due::NEVER);
        for _ in 0..2 * AHEAD {
            let list = lists.next();
            assert!(!lists.is_due(due), "who stands still is not looked at");
            lists.recycle(list);
        }
    }
}
