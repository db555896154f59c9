!! What is said of the stability of a motion, the same wherever it is said.
module razy_core_verdict
   implicit none(type, external)
   private

   public :: is_absent, is_neutral, is_stable, is_undecided, is_unstable, verdict_words, verdicts

   !> It decays; it grows; the error of its eigenvalue or multiplier covers the bound; it neither grows nor decays, as by structure
   !> nothing damps or drives it; there is no such motion.
   integer, parameter :: is_stable = 1, is_unstable = 0, is_undecided = -1, is_neutral = 2, is_absent = -2
   integer, parameter :: verdicts(5) = [is_stable, is_unstable, is_undecided, is_neutral, is_absent]
   character(*), parameter :: verdict_words(5) = [character(9) :: "stable", "unstable", "undecided", "neutral", "absent"]

end module razy_core_verdict
