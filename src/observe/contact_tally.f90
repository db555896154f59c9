!! What is added up of one contact, and what the sums mean.
!!
!! With F the restoring force of the law and s' the rate of its variable, the work done on the contact is W = ∫ F s' dt. What of
!! it is stored comes back: U(s) = ∫ F(σ, 0) dσ from the edge of the gap (of a spring: from s = 0) to s while the contact is
!! closed on an elastic side, else 0. The energy dissipated in the contact from the start of recording to the end is
!!
!!     D = W - (U_end - U_start) + Σ -½ p (s'₊ + s'₋),
!!
!! the sum over impacts of rigid contacts with the impulses p: kinetic energy of the relative motion that is lost. Over a cycle
!! from open to open D is ∮ F s' dt. For F = k(s - e) + b s' that is ∫ b s'² dt, and, where a side parts at zero force, the
!! energy that is still stored then too: it is lost in the relaxation of the surface.
module razy_observe_contact_tally
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   use razy_core_table, only: table_t
   use razy_machine_machine, only: contact_t
   implicit none(type, external)
   private

   public :: contact_tally_t

   !> The sums of one contact, number `number` of the machine.
   type :: contact_tally_t
      integer :: number = 0
      type(contact_t) :: contact
      !> What presses a friction element, if it is a contact.
      type(contact_t), allocatable :: normal
      !> Largest |F|, ∫F dt with the sign of the reported force, W, energy lost in impacts, U at the start and now; s' of impacts.
      real(wp) :: largest = 0.0_wp, impulse = 0.0_wp, work = 0.0_wp, lost = 0.0_wp, stored_first = 0.0_wp, stored = 0.0_wp
      real(wp) :: speed = 0.0_wp, speeds = 0.0_wp, time_closed = 0.0_wp, time_lower = 0.0_wp, time_stuck = 0.0_wp
      integer :: impacts = 0
      logical :: closed = .false.
   contains
      procedure :: impact
      procedure :: columns
   end type contact_tally_t

contains

   !> Count an impact with this speed.
   pure subroutine impact(self, speed)
      class(contact_tally_t), intent(inout) :: self
      real(wp), intent(in) :: speed

      self%impacts = self%impacts + 1
      self%speed = max(self%speed, speed)
      self%speeds = self%speeds + speed
   end subroutine impact

   !> Hand over the statistics of a recorded time, s, with a period of excitation, s, as single values of `/contact/<name>`; those
   !> per period are NaN where there is none (0), and all are where nothing was seen.
   subroutine columns(self, table, time, period, seen)
      class(contact_tally_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: time, period
      logical, intent(in) :: seen

      real(wp) :: dissipated, factor, mean, mean_speed, nan, share, whole

      nan = ieee_value(nan, ieee_quiet_nan)
      dissipated = self%work - (self%stored - self%stored_first) + self%lost
      mean_speed = self%speeds/max(1, self%impacts)
      whole = merge(time, 1.0_wp, time > 0.0_wp)
      mean = nan
      if (time > 0.0_wp) mean = self%impulse/time
      factor = nan
      ! Of elements that share a force only the sum may be determined.
      if (.not. ieee_is_nan(mean)) then
         if (abs(mean) > epsilon(mean)*self%largest) factor = self%largest/abs(mean)
      end if
      share = nan
      if (period > 0.0_wp .and. time > 0.0_wp) share = period/time
      associate (contact => self%contact)
         call put("largest_force", self%largest, contact%force_unit, "largest magnitude of the force")
         call put("impulse", self%impulse, contact%force_unit//" s", "integral of the force")
         call put("impacts", real(self%impacts, wp), "1", "times that the contact closed")
         call put("impact_speed", self%speed, contact%unit//"/s", "largest speed of closing")
         call put("mean_impact_speed", mean_speed, contact%unit//"/s", "mean speed of closing")
         call put("closed_share", self%time_closed/whole, "1", "share of time closed")
         call put("dissipated_energy", dissipated, "J", "energy dissipated in the contact")
         call put("impulse_per_period", share*self%impulse, contact%force_unit//" s", &
                  "integral of the force per period of excitation")
         call put("impacts_per_period", share*self%impacts, "1", "times that the contact closed per period of excitation")
         call put("dissipated_energy_per_period", share*dissipated, "J", "energy dissipated per period of excitation")
         call put("lower_share", self%time_lower/whole, "1", "share of time closed on the lower side")
         if (contact%law%of_normal) call put("sticking_share", self%time_stuck/whole, "1", &
                                             "share of time sticking, or rolling")
         call put("mean_force", mean, contact%force_unit, "mean force")
         call put("dynamic_factor", factor, "1", "largest magnitude of the force over that of its mean")
      end associate

   contains

      subroutine put(name, value, unit, meaning)
         character(*), intent(in) :: name, unit, meaning
         real(wp), intent(in) :: value

         call table%add("/contact/"//self%contact%name//"/"//name, merge(value, nan, seen), unit, &
                        self%contact%name//": "//meaning)
      end subroutine put

   end subroutine columns

end module razy_observe_contact_tally
