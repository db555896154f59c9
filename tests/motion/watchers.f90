!! Observers for tests, and one call that runs a machine.
module watchers
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_exact_exact, only: exact_t
   use razy_motion_integrator, only: observer_slot_t, observer_t, outcome_t, piece_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: event_log_t, sampler_t, simulate

   !> Time, contact and new branch of every event, and every contact state met (as a number of base 10).
   type, extends(observer_t) :: event_log_t
      integer :: count = 0
      !> Contacts of the machine, set by `simulate`.
      integer :: contacts = 0
      real(wp), allocatable :: time(:)
      integer, allocatable :: contact(:), branch(:), state(:)
   contains
      procedure :: piece => log_piece
   end type event_log_t

   !> Values of all observables (forms, times) at given ascending times.
   type, extends(observer_t) :: sampler_t
      real(wp), allocatable :: time(:), value(:, :)
      integer :: done = 0, forms = 0
   contains
      procedure :: piece => sample_piece
   end type sampler_t

contains

   subroutine log_piece(self, part)
      class(event_log_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      integer :: j, code

      if (.not. allocated(self%time)) allocate (self%time(1024), self%contact(1024), self%branch(1024), self%state(0))
      code = 0
      do j = 1, self%contacts
         code = 10*code + part%by%branch(j)
      end do
      if (.not. any(self%state == code)) self%state = [self%state, code]
      if (part%contact == 0) return
      if (self%count == size(self%time)) then
         self%time = [self%time, self%time]
         self%contact = [self%contact, self%contact]
         self%branch = [self%branch, self%branch]
      end if
      self%count = self%count + 1
      self%time(self%count) = part%time + (part%time_low + part%duration)
      self%contact(self%count) = part%contact
      self%branch(self%count) = part%branch
   end subroutine log_piece

   subroutine sample_piece(self, part)
      class(sampler_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp) :: tau
      integer :: j

      if (.not. allocated(self%value)) allocate (self%value(self%forms, size(self%time)), source=0.0_wp)
      do while (self%done < size(self%time))
         tau = (self%time(self%done + 1) - part%time) - part%time_low
         if (tau > part%duration .and. .not. part%last) return
         self%done = self%done + 1
         do j = 1, self%forms
            self%value(j, self%done) = part%by%value(j, tau)
         end do
      end do
   end subroutine sample_piece

   !> Run a machine from 0 to `t_end`, s, by `propagator` or a new one.
   subroutine simulate(machine, t_end, outcome, first, second, third, propagator, keep_all, most_events)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end
      type(outcome_t), intent(out) :: outcome
      class(observer_t), intent(inout), target, optional :: first, second, third
      type(exact_t), intent(inout), target, optional :: propagator
      logical, intent(in), optional :: keep_all
      integer(i8), intent(in), optional :: most_events

      type(exact_t), target :: own
      type(observer_slot_t) :: slot(3)
      integer(i8) :: limit
      integer :: i, n
      logical :: everything

      n = 0
      if (present(first)) n = 1
      if (present(first)) slot(1)%observer => first
      if (present(second)) n = 2
      if (present(second)) slot(2)%observer => second
      if (present(third)) n = 3
      if (present(third)) slot(3)%observer => third
      do i = 1, n
         select type (watcher => slot(i)%observer)
         type is (event_log_t)
            watcher%contacts = size(machine%contact)
         type is (sampler_t)
            watcher%forms = size(machine%observable)
         end select
      end do
      everything = .false.
      if (present(keep_all)) everything = keep_all
      limit = huge(limit)
      if (present(most_events)) limit = most_events
      if (present(propagator)) then
         call go(propagator)
      else
         call go(own)
      end if

   contains

      subroutine go(exact)
         type(exact_t), intent(inout), target :: exact

         type(error_t), allocatable :: error

         call exact%prepare(machine, everything, error)
         if (allocated(error)) error stop "the machine was refused"
         call exact%run(t_end, limit, slot(:n), outcome)
      end subroutine go

   end subroutine simulate

end module watchers
