!! The functions of a piece that begins as the transition has settled it, from the state: what is rounding in them, and which of
!! them start on their bounds.
module razy_exact_settled
   use razy_core_kinds, only: wp
   use razy_exact_search_search, only: rounding
   use razy_exact_solution, only: solution_t
   use razy_hybrid_guards, only: guard_entry_t, guards_t, lowest_flight, of_force, of_press
   use razy_hybrid_system, only: system_t
   use razy_hybrid_transition, only: transition_t
   implicit none(type, external)
   private

   public :: prepare_settled, take_sizes

   !> A part of the acceleration that is not what is left of it where a force has come to zero.
   real(wp), parameter :: clearly = 1.0e-6_wp

contains

   !> After what the transition settled: what is rounding in the functions at z, and which of them start on their bounds. As the
   !> branches are settled these move inwards, or rest if they are fixed. Where friction has pulled open the stop that it goes with,
   !> no branch of the laws lasts, and the gap goes outwards at once.
   subroutine prepare_settled(solution, system, transition, z)
      type(solution_t), intent(inout) :: solution
      type(system_t), intent(in) :: system
      type(transition_t), intent(inout) :: transition
      real(wp), intent(in) :: z(:)

      real(wp), dimension(transition%guards%count) :: g, rate
      integer :: t
      logical :: on_bound

      associate (guards => transition%guards)
         call guards%look(system, transition%dynamics, 0.0_wp, z, g, rate)
         do t = 1, size(solution%watched)
            associate (watched => solution%watched(t), guard => solution%entry(t))
               watched%from_zero = .false.
               watched%at_rest = .false.
               watched%floor = 0.0_wp
               if (guard%function == of_press) cycle
               watched%floor = guards%noise(t)
               watched%initial = g(t)
               on_bound = abs(g(t)) <= guards%noise(t)
               watched%from_zero = on_bound
               watched%slip = merge(max(-rate(t), 0.0_wp), 0.0_wp, on_bound .and. guard%function > 0 &
                                    .and. .not. abs(guard%beta) > 0.0_wp .and. -rate(t) <= guards%on_rate(guard%contact))
               if (on_bound .and. any(system%machine%contact%only_with == guard%contact)) then
                  if (.not. rate(t) > guards%on_rate(guard%contact)) watched%from_zero = .not. falls(guard)
               end if
               watched%at_rest = on_bound .and. solution%fixed(t) &
                                 .and. (guard%function == of_force .or. abs(rate(t)) <= guards%on_rate(guard%contact))
            end associate
         end do
      end associate

   contains

      !> Whether the gap that a guard looks at is clearly pulled outwards.
      logical function falls(guard)
         type(guard_entry_t), intent(in) :: guard

         real(wp) :: a(system%m)

         associate (dynamics => transition%dynamics, j => guard%contact)
            call dynamics%accelerate(system, 0.0_wp, z, a)
            falls = guard%side*guard%alpha*dynamics%second_rate(system, j, a) &
                    < -clearly*norm2(a)*transition%guards%reach(j)
         end associate
      end function falls

   end subroutine prepare_settled

   !> Take up the size of the terms that the functions are sums of, and with it what is rounding in s and s'.
   !> Lower flights than `lowest_flight` are not followed, so the roundings of s may be as many times as large.
   subroutine take_sizes(solution, guards)
      type(solution_t), intent(in) :: solution
      type(guards_t), intent(inout) :: guards

      integer :: t

      do t = 1, size(solution%watched)
         associate (guard => solution%entry(t), j => solution%entry(t)%contact, &
                    scale => max(solution%watched(t)%scale, solution%watched(t)%noise/rounding))
            if (guard%function <= 0) cycle
            if (.not. abs(guard%beta) > 0.0_wp) then
               guards%size_s(j) = max(guards%size_s(j), scale/(lowest_flight*abs(guard%alpha)))
            else if (.not. abs(guard%alpha) > 0.0_wp) then
               guards%size_rate(j) = max(guards%size_rate(j), scale/abs(guard%beta))
               ! Speeds between events, to whose rounding those at them are known.
               guards%seen(2) = max(guards%seen(2), guards%size_rate(j)/guards%reach(j))
            end if
         end associate
      end do
   end subroutine take_sizes

end module razy_exact_settled
