!! Rigid sides that touch at an event: which they are, their impact with the friction that they press (razy_hybrid_impact), and the
!! way out of stops that a motion would begin beyond.
module razy_hybrid_event_touching
   use razy_contact_gap_law, only: branch_open
   use razy_core_kinds, only: wp
   use razy_hybrid_active_sides, only: find_sides
   use razy_hybrid_guards, only: lowest_flight
   use razy_hybrid_impact, only: are_jammed, impact_derivative_t, push_apart, strike
   use razy_hybrid_system, only: system_t
   use razy_hybrid_transition, only: transition_t
   implicit none(type, external)
   private

   public :: push_out, take_impact, touch

   !> Impacts in turn that are tried: those of a row of bodies without restitution come to rest only in the limit.
   integer, parameter :: most_in_turn = 100000

contains

   !> The rigid sides that touch. What is hit at the same time is stirred as well.
   subroutine touch(self, system)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: found, j

      associate (dynamics => self%dynamics, guards => self%guards, n => self%sides, &
                 hit_now => .not. self%accumulation%since > 0.0_wp)
         ! What is thrown back without a flight that is followed touches all that was hit at this time.
         call find_sides(system%machine%contact, dynamics%s, dynamics%rate, &
                         merge(lowest_flight, 1.0_wp, hit_now .and. any(hit_now .and. any(self%left, 1)))*guards%on_s, &
                         guards%on_rate, self%before, self%left, self%let_go, self%side, n)
         do j = 1, n
            if (self%side(j)%before < 0.0_wp) self%stirred(self%side(j)%contact) = .true.
         end do
         if (all(self%stirred)) return
         self%stirred = [(any(self%stirred .and. system%feels == system%feels(j)), j=1, size(self%next))]
         found = count(self%stirred(self%side(:n)%contact))
         self%side(:found) = pack(self%side(:n), self%stirred(self%side(:n)%contact))
         n = found
      end associate
   end subroutine touch

   !> Impacts until no side approaches: of all sides that touch and do not open, at once, or of those that approach alone, in turn.
   !> What is hit may be held again. Each side's speed before is that with which it is hit first.
   subroutine take_impact(self, system, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(inout) :: z(:)

      !> Stays unallocated, and so absent, if it is not wanted.
      type(impact_derivative_t), allocatable :: derivative
      real(wp), dimension(size(self%next)) :: noise, rate
      real(wp) :: before(self%sides), change(system%m), still(system%m)
      logical :: jammed(self%sides), joined(self%sides)
      integer :: i, n, round, who(self%sides)

      if (self%saltation%wanted) allocate (derivative)
      still = 0.0_wp
      rate = self%dynamics%rate
      noise = self%guards%on_rate
      associate (side => self%side(:self%sides), machine => system%machine, w => self%dynamics%w)
         jammed = are_jammed(w, side)
         ! The speed of what is jammed is a sum of the others', and so is its rounding.
         where (jammed .and. abs(side%before) <= sum(noise(side%contact), jammed)) side%before = 0.0_wp
         side%after = side%before
         before = side%before
         joined = side%held
         do round = 1, most_in_turn
            n = 0
            do i = 1, self%sides
               if (.not. side(i)%after < 0.0_wp .and. (machine%impacts_in_turn .or. (side(i)%after > 0.0_wp &
                                                                                     .and. .not. jammed(i)))) cycle
               n = n + 1
               who(n) = i
            end do
            call strike(machine%contact, w, rate, noise, side, who(:n), jammed, self%problem, change, self%found, derivative)
            if (.not. self%found) return
            z(system%m + 1:) = z(system%m + 1:) + change
            if (allocated(derivative)) then
               self%saltation%defined = self%saltation%defined .and. derivative%defined
               ! What only touches, or is hit beside another one, would be so at another time, or in another order.
               if (round > 1) self%saltation%defined = self%saltation%defined .and. n == 1 .and. all(joined(who(:n)))
               call self%saltation%add_impulses(derivative%effect, derivative%direction, derivative%sign &
                                                *[(self%dynamics%second_rate(system, derivative%contact(i), still), &
                                                   i=1, size(derivative%contact))])
            end if
            ! Of what took part at once only rounding is left.
            if (.not. machine%impacts_in_turn) side(who(:n))%after = max(0.0_wp, side(who(:n))%after)
            self%found = .not. any(side%after < 0.0_wp)
            if (self%found) exit
            joined(who(:n)) = .true.
            rate = rate + matmul(change, w)
            ! What was at rest has had none so far.
            noise = max(noise, epsilon(1.0_wp)*norm2(change)*norm2(w, dim=1))
            side%before = side%direction*rate(side%contact)
            before = merge(side%after, before, side%after < 0.0_wp .and. .not. before < 0.0_wp)
         end do
         side%before = before
         do i = 1, self%sides
            self%let_go(side(i)%contact) = .false.
         end do
         self%let_go = self%let_go .and. .not. machine%contact%normal_of > 0
         self%impacts = count(before < 0.0_wp)
      end associate
   end subroutine take_impact

   !> Move z out of rigid stops that it starts beyond, by the shortest way.
   subroutine push_out(self, system, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(inout) :: z(:)

      real(wp) :: change(system%m)
      logical :: moved

      self%before = branch_open
      self%let_go = .false.
      self%stirred = .true.
      self%left = .false.
      call touch(self, system)
      call push_apart(system%w, self%dynamics%s, self%guards%on_s, self%side(:self%sides), change, moved, self%found)
      if (moved .and. self%found) z(:system%m) = z(:system%m) + change
   end subroutine push_out

end module razy_hybrid_event_touching
