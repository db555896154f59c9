!! Branches of compliant laws that a motion passes in no time: where it arrives at a branch, it may be beyond that as well.
module razy_hybrid_passed_branches
   use razy_contact_contact_law, only: contact_law_t
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: branch_beyond

   !> Rounding of a constant of a switching function, and of its bound, as in razy_hybrid_guards.
   real(wp), parameter :: of_constant = 16*epsilon(1.0_wp)

contains

   !> The branch that follows `branch` at once at s and s' with their rounding, as a switching function is beyond a bound, or on it
   !> and about to cross; 0 if there is none. The rate of a function of s' needs s'', so it counts as none.
   pure function branch_beyond(law, branch, s, rate, noise_s, noise_rate) result(next)
      class(contact_law_t), intent(in) :: law
      integer, intent(in) :: branch
      real(wp), intent(in) :: s, rate, noise_s, noise_rate
      integer :: next

      real(wp) :: noise, slope, value
      integer :: f

      next = 0
      do f = 1, law%functions
         value = law%slope(1, f)*s + law%slope(2, f)*rate + law%constant(f)
         slope = law%slope(1, f)*rate
         if (abs(law%slope(2, f)) > 0.0_wp .or. abs(rate) <= noise_rate) slope = 0.0_wp
         noise = abs(law%slope(1, f))*noise_s + abs(law%slope(2, f))*noise_rate + of_constant*abs(law%constant(f))
         associate (guard => law%guard(f, branch))
            if (guard%below /= 0 .and. beyond(value - guard%lower, slope, noise + of_constant*abs(guard%lower))) then
               next = guard%below
            else if (guard%above /= 0 .and. beyond(guard%upper - value, -slope, noise + of_constant*abs(guard%upper))) then
               next = guard%above
            end if
         end associate
         if (next /= 0) return
      end do
   end function branch_beyond

   !> Whether g is below 0, or 0 and falling.
   pure logical function beyond(g, rate, noise)
      real(wp), intent(in) :: g, rate, noise

      beyond = (g < -noise .and. .not. rate > 0.0_wp) .or. (g <= noise .and. rate < 0.0_wp)
   end function beyond

end module razy_hybrid_passed_branches
