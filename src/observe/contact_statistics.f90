!! Statistics of contacts from a given time on: largest force, impulse, closings and their speeds, time closed, energy dissipated
!! (razy_observe_contact_tally says what each is).
!!
!! Integrals and peaks are the integrator's own where it has a closed form. Otherwise they are those of Gauss-Legendre with eight
!! points on parts of at most eight natural intervals of the integrator: with `exact` two radians of the fastest term, with the
!! others a step. An impact is a change from open or parting to closed, or a
!! jump of s' at a rigid contact; a time-stepping method spreads a jump over a step, where its impulse is a force.
module razy_observe_contact_statistics
   use razy_contact_friction_law, only: strained_forward
   use razy_core_kinds, only: wp
   use razy_core_table, only: table_t
   use razy_machine_excitation, only: period_of_loads
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: observer_t, piece_t
   use razy_observe_contact_tally, only: contact_tally_t
   use razy_linalg_gauss, only: abscissa, peak_of, points, weight
   use razy_observe_rigid_impacts, only: rigid_impacts_t
   implicit none(type, external)
   private

   public :: contact_statistics_t

   type, extends(observer_t) :: contact_statistics_t
      !> Contacts that are recorded, by number.
      integer, allocatable :: numbers(:)
      !> What has been recorded, s.
      real(wp), private :: time = 0.0_wp
      !> Period of the excitation, s.
      real(wp), private :: period = 0.0_wp
      type(contact_tally_t), allocatable :: tally(:)
      type(rigid_impacts_t), private :: rigid
      !> Recording has begun; a machine was taken and not forgotten.
      logical, private :: begun = .false., attached = .false.
   contains
      procedure :: attach
      procedure :: piece
      procedure :: forget
      procedure :: columns
   end type contact_statistics_t

   !> Natural intervals in a part of the quadrature.
   integer, parameter :: intervals = 8
   !> The peak of a part is only looked for if a point of it reaches this share of the largest force so far.
   real(wp), parameter :: close_to_largest = 0.9_wp

contains

   subroutine attach(self, machine, t_end)
      class(contact_statistics_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end

      integer :: i

      if (allocated(self%tally)) deallocate (self%tally)
      allocate (self%tally(size(self%numbers)))
      do i = 1, size(self%numbers)
         self%tally(i)%number = self%numbers(i)
         self%tally(i)%contact = machine%contact(self%numbers(i))
         associate (normal => self%tally(i)%contact%normal_of)
            if (normal > 0) allocate (self%tally(i)%normal, source=machine%contact(normal))
         end associate
      end do
      call self%rigid%attach(machine)
      associate (unused => t_end)
         self%period = period_of_loads(machine)
      end associate
      self%time = 0.0_wp
      self%begun = .false.
      self%attached = .true.
   end subroutine attach

   subroutine forget(self)
      class(contact_statistics_t), intent(inout) :: self

      self%attached = .false.
   end subroutine forget

   !> Hand over the statistics; NaN where there was no machine.
   subroutine columns(self, table, machine)
      class(contact_statistics_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      type(machine_t), intent(in) :: machine

      integer :: i

      associate (unused => machine)
         do i = 1, size(self%tally)
            call self%tally(i)%columns(table, self%time, self%period, self%attached)
         end do
      end associate
   end subroutine columns

   !> Add a piece, as far as it lies in the time of recording.
   subroutine piece(self, part)
      class(contact_statistics_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp) :: tau

      tau = max((self%from - part%time) - part%time_low, 0.0_wp)
      if (tau > part%duration) return
      if (part%duration > 0.0_wp) then
         call self%rigid%look_after(part%by, tau)
         call begin_piece(self, part, tau)
         self%begun = .true.
         if (tau < part%duration) call integrate(self, part, tau)
      end if
      call self%rigid%look_before(part)
   end subroutine piece

   !> Closings and jumps at the start `tau` of a piece; energies that are stored at the start of recording.
   subroutine begin_piece(self, part, tau)
      type(contact_statistics_t), intent(inout) :: self
      type(piece_t), intent(in) :: part
      real(wp), intent(in) :: tau

      real(wp) :: force, rate, s
      logical :: closed, closing
      integer :: branch, i

      do i = 1, size(self%tally)
         associate (tally => self%tally(i))
            branch = part%by%branch(tally%number)
            closed = tally%contact%law%branch(branch)%closed
            closing = closed .and. .not. tally%closed .and. self%begun
            if (.not. self%begun .and. closed) then
               call part%by%contact(tally%number, tau, s, rate, force)
               tally%stored_first = tally%contact%law%energy(branch, s)
               tally%stored = tally%stored_first
            end if
            if (.not. closed) tally%stored = 0.0_wp
            call impacts(self, i, part%by%spreads_impacts, closing)
            tally%closed = closed
            if (.not. closing) cycle
            call part%by%contact(tally%number, tau, s, rate, force)
            call tally%impact(abs(rate))
         end associate
      end do
   end subroutine begin_piece

   !> Add the jump of contact i of those recorded, if there is one: of a rigid one that alone is an impact, no `closing`. What is
   !> `spread` over a time step is in its integrals.
   subroutine impacts(self, i, spread, closing)
      type(contact_statistics_t), intent(inout) :: self
      integer, intent(in) :: i
      logical, intent(in) :: spread
      logical, intent(inout) :: closing

      integer :: k

      associate (tally => self%tally(i), rigid => self%rigid)
         k = findloc(rigid%number, tally%number, dim=1)
         if (k == 0) return
         ! A contact that opens, or that another's impact throws up, is not hit, nor does the end of its impacts hit it.
         closing = .false.
         if (rigid%jumped(k) .and. tally%contact%law%impacts .and. .not. tally%closed) call tally%impact(abs(rigid%before(k)))
         if (spread) return
         tally%impulse = tally%impulse - tally%contact%force_sign*rigid%impulse(k)
         tally%lost = tally%lost - 0.5_wp*rigid%impulse(k)*(rigid%before(k) + rigid%after(k))
      end associate
   end subroutine impacts

   !> Add the integrals from `tau` to the end of a piece.
   subroutine integrate(self, part, tau)
      type(contact_statistics_t), intent(inout) :: self
      type(piece_t), intent(in) :: part
      real(wp), intent(in) :: tau

      real(wp) :: at_end, force, rate, s
      logical :: active(size(self%tally)), known, sticks
      integer :: i, k, n

      self%time = self%time + (part%duration - tau)
      do i = 1, size(self%tally)
         associate (tally => self%tally(i))
            if (tally%closed) tally%time_closed = tally%time_closed + (part%duration - tau)
            associate (branch => tally%contact%law%branch(part%by%branch(tally%number)))
               if (tally%closed .and. branch%side < 0) tally%time_lower = tally%time_lower + (part%duration - tau)
               sticks = branch%constraint .or. &
                        tally%contact%law%of_normal .and. part%by%branch(tally%number) >= strained_forward
               if (sticks .and. allocated(tally%normal)) then
                  sticks = tally%normal%law%branch(part%by%branch(tally%contact%normal_of))%closed
               end if
               if (sticks) tally%time_stuck = tally%time_stuck + (part%duration - tau)
            end associate
            call part%by%contact_sums(tally%number, tau, tally%largest, tally%impulse, tally%work, known)
            active(i) = tally%closed .and. .not. known
            if (active(i) .or. known) cycle
            ! Smoothed laws have a force in open contacts too.
            call part%by%contact(tally%number, tau, s, rate, force)
            call part%by%contact(tally%number, part%duration, s, rate, at_end)
            active(i) = abs(force) > 0.0_wp .or. abs(at_end) > 0.0_wp
         end associate
      end do
      n = 0
      if (any(active)) n = max(1, ceiling((part%duration - tau)/(intervals*part%by%interval())))
      do k = 1, n
         call add_part(self, part, active, tau + (part%duration - tau)*(real(k - 1, wp)/n), (part%duration - tau)/n)
      end do
      do i = 1, size(self%tally)
         associate (tally => self%tally(i))
            if (.not. tally%closed) cycle
            call part%by%contact(tally%number, part%duration, s, rate, force)
            tally%stored = tally%contact%law%energy(part%by%branch(tally%number), s)
         end associate
      end do
   end subroutine integrate

   !> Add the integrals of the active contacts over `length` s from `tau` on, and see whether a force is the largest.
   subroutine add_part(self, part, active, tau, length)
      type(contact_statistics_t), intent(inout) :: self
      type(piece_t), intent(in) :: part
      logical, intent(in) :: active(:)
      real(wp), intent(in) :: tau, length

      real(wp) :: at, force(points, size(active)), peak, rate, s
      integer :: i, k

      do k = 1, points
         at = min(tau + length*abscissa(k), part%duration)
         do i = 1, size(active)
            if (.not. active(i)) cycle
            associate (tally => self%tally(i))
               call part%by%contact(tally%number, at, s, rate, force(k, i))
               tally%impulse = tally%impulse + length*weight(k)*force(k, i)
               tally%work = tally%work + length*weight(k)*tally%contact%force_sign*force(k, i)*rate
            end associate
         end do
      end do
      do i = 1, size(active)
         if (.not. active(i)) cycle
         associate (tally => self%tally(i))
            if (maxval(abs(force(:, i))) < close_to_largest*tally%largest) cycle
            at = min(tau + length*peak_of(abs(force(:, i))), part%duration)
            call part%by%contact(tally%number, at, s, rate, peak)
            tally%largest = max(tally%largest, abs(peak), maxval(abs(force(:, i))))
         end associate
      end do
   end subroutine add_part

end module razy_observe_contact_statistics
