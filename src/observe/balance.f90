!! Whether a motion obeys the machine's own equations: balances of momentum and energy along pieces of it as observers see them.
!!
!! Over a stretch [a, b] of a piece, by Gauss's rule of eight points, with the machine's matrices and the state that is followed,
!!
!!     q(b) - q(a) = ∫ q' dt,   M (q'(b) - q'(a)) = ∫ p dt,   ½ q'ᵀM q' at b less that at a = ∫ q'ᵀ p dt,
!!     rᵀM (q'(b) - q'(a)) = ∫ rᵀ (f - Σ_j w_j F_j) dt,   p = f - B q' - K q - Σ_j w_j F_j,
!!
!! for every rigid motion r, free of stiffness and damping; f is what of the loads moves what is followed, and q'ᵀp is the power of
!! loads, springs, dampers, circulatory terms and all that contacts do. From there to the piece that follows displacements do not
!! jump, and M q' jumps along contacts that are rigid or have friction alone. An early piece is looked at, the last and one of a
!! thousand. From the first piece to the last the momentum along motions that nothing but loads acts on grows by their integral;
!! that is not looked at where a tone is swept, a waveform or does not turn.
!!
!! What is missing counts over the size of the terms in the motion.
module razy_observe_balance
   use razy_core_kinds, only: i8, wp
   use razy_linalg_null_space, only: null_space
   use razy_machine_free_motions, only: keep_unstretched, open_motions
   use razy_machine_machine, only: machine_t, push_of
   use razy_motion_integrator, only: observer_t, piece_t
   use razy_linalg_gauss, only: abscissa, points, weight
   implicit none(type, external)
   private

   public :: balance_t

   type, extends(observer_t) :: balance_t
      !> The largest of what was missing in displacements, momentum, energy, momentum along rigid motions and in that of the whole
      !> motion, and the largest sizes of their terms.
      real(wp), private :: missing(5) = 0.0_wp, terms(5) = 0.0_wp
      type(machine_t), private :: machine
      !> Rigid motions with all contacts open, those that no contact feels, and motions along which no contact gives an impulse
      !> (n, motions each); 1/sqrt(M_ii) (n).
      real(wp), allocatable, private :: rigid(:, :), untouched(:, :), unpushed(:, :), root(:)
      !> Constant loads and phasors of those of tones (n, 1 + tones), as far as they move what is followed.
      complex(wp), allocatable, private :: load(:, :)
      !> Momentum less the integrals of loads, at the start of the motion (n).
      real(wp), allocatable, private :: conserved(:)
      !> Displacements and velocities at the end of the piece before (n, 2), if it was looked at, and sizes of displacements and of
      !> momentum in it (n each).
      real(wp), allocatable, private :: z(:, :), reach(:), speed(:)
      logical, private :: ended = .false.
      !> Pieces so far, and the number of the next whose turn it is.
      integer(i8), private :: pieces = 0, due = 1
   contains
      procedure :: attach
      procedure :: piece
      procedure :: residual
   end type balance_t

   !> Pieces that are looked at beside the last: an early one, by number, and one of so many. Methods with steps begin with tiny
   !> ones.
   integer(i8), parameter :: early = 32, seldom = 1000
   !> Most natural intervals in a stretch.
   integer, parameter :: intervals = 8
   !> Most angle of what no contact feels in a stretch.
   real(wp), parameter :: angle = 2.0_wp

contains

   subroutine attach(self, machine, t_end)
      class(balance_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end

      real(wp), allocatable :: unused(:, :)
      integer :: i, info

      associate (unused_end => t_end)
         self%machine = machine
      end associate
      allocate (self%z(size(machine%load), 2))
      self%root = [(1/sqrt(machine%mass(i, i)), i=1, size(machine%load))]
      call open_motions(machine, unused, self%rigid)
      self%untouched = self%rigid
      call keep_unstretched(self%untouched, machine, [(.true., i=1, size(machine%contact))])
      call null_space(reshape([(merge(machine%contact(i)%w, 0.0_wp, machine%contact(i)%law%impacts .or. &
                                      machine%contact(i)%law%of_normal), i=1, size(machine%contact))], &
                              [size(self%root), size(machine%contact)]), self%unpushed, info)
   end subroutine attach

   !> Look at a piece if it is its turn, and at what led to it if the one before was looked at.
   subroutine piece(self, part)
      class(balance_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      if (.not. part%duration > 0.0_wp) return
      self%pieces = self%pieces + 1
      if (self%pieces >= self%due .or. self%ended .or. part%last) call look(self, part)
   end subroutine piece

   subroutine look(self, part)
      type(balance_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      if (self%ended .and. part%by%complete) call look_at_jump(self, part)
      self%ended = .false.
      if (.not. part%by%complete) return
      associate (constant => self%machine%load, harmonic => self%machine%harmonic_load)
         if (.not. allocated(self%load)) then
            self%load = cmplx(part%by%followed(reshape([constant, harmonic%re], shape(harmonic) + [0, 1])), &
                              part%by%followed(reshape([0*constant, harmonic%im], shape(harmonic) + [0, 1])), wp)
         end if
      end associate
      if (self%pieces == 1) call look_at_momentum(self, part, 0.0_wp)
      if (self%pieces > 1 .and. self%pieces >= self%due .or. part%last) call look_at_stretch(self, part)
      self%due = merge(early, seldom*(self%pieces/seldom + 1), self%pieces < early)
      if (part%last) call look_at_momentum(self, part, part%duration)
   end subroutine look

   !> The balances over the end of a piece.
   subroutine look_at_stretch(self, part)
      type(balance_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp), dimension(size(self%root)) :: q, v, change
      real(wp) :: sums(size(self%root), 8), length

      length = min(part%duration, intervals*part%by%interval(), angle/max(part%by%aside, tiny(angle)))
      call integrate(self, part, length, sums)
      call part%by%state(part%duration - length, q, v)
      call part%by%state(part%duration, self%z(:, 1), self%z(:, 2))
      change = matmul(self%machine%mass, self%z(:, 2) - v)
      self%speed = matmul(abs(self%machine%mass), abs(self%z(:, 2)) + abs(v)) + sums(:, 3)
      self%reach = abs(self%z(:, 1)) + abs(q) + length*(abs(self%z(:, 2)) + abs(v) + self%root**2*sums(:, 3))
      self%ended = .true.
      call keep(self, 1, (self%z(:, 1) - q - sums(:, 1))/self%root, self%reach/self%root)
      call keep(self, 2, self%root*(change - sums(:, 2)), self%root*self%speed)
      call keep(self, 3, [dot_product(0.5_wp*(self%z(:, 2) + v), change) - sum(sums(:, 6))], [sum((self%root*self%speed)**2)])
      call keep_along(self, 4, self%rigid, change - sums(:, 4), self%speed - sums(:, 3) + sums(:, 5))
   end subroutine look_at_stretch

   !> Integrals over the last `length` s of the piece of q', p, the size of its terms, what of p rigid motions feel, the size of the
   !> terms of that, powers, |q| and |q'| (n, 8).
   subroutine integrate(self, part, length, sums)
      type(balance_t), intent(in) :: self
      type(piece_t), intent(in) :: part
      real(wp), intent(in) :: length
      real(wp), intent(out) :: sums(:, :)

      complex(wp) :: e(size(self%machine%tone))
      real(wp), dimension(size(self%root)) :: q, v, outer, push, all
      real(wp) :: dt, force, rate, s, tau
      integer :: i, j

      sums = 0.0_wp
      associate (machine => self%machine)
         do i = 2, points - 1
            tau = part%duration - (1 - abscissa(i))*length
            dt = weight(i)*length
            call part%by%state(tau, q, v)
            outer = self%load(:, 1)%re
            sums(:, 5) = sums(:, 5) + dt*abs(outer)
            do j = 1, size(machine%tone)
               e(j) = machine%tone(j)%excitation(part%time, part%time_low + tau)
               if (machine%tone(j)%is_swept()) e(j) = sum(machine%tone(j)%swept(part%time + tau, e(j))*[1, 0, 0])
               outer = outer + (self%load(:, 1 + j)%re*e(j)%re - self%load(:, 1 + j)%im*e(j)%im)
               sums(:, 5) = sums(:, 5) + dt*abs(self%load(:, 1 + j))*abs(e(j))
            end do
            do j = 1, size(machine%contact)
               call part%by%contact(j, tau, s, rate, force)
               push = force*push_of(machine%contact(j), q, e)
               outer = outer - machine%contact(j)%force_sign*push
               sums(:, 5) = sums(:, 5) + dt*abs(push)
            end do
            all = outer - matmul(machine%stiffness, q) - matmul(machine%damping, v)
            if (allocated(machine%by_speed)) all = all - machine%by_speed%times(machine%acceleration*(part%time + tau), 0, q, v)
            sums(:, 1) = sums(:, 1) + dt*v
            sums(:, 2) = sums(:, 2) + dt*all
            sums(:, 4) = sums(:, 4) + dt*outer
            sums(:, 6) = sums(:, 6) + dt*v*all
            sums(:, 7) = sums(:, 7) + dt*abs(q)
            sums(:, 8) = sums(:, 8) + dt*abs(v)
         end do
         sums(:, 3) = sums(:, 5) + matmul(abs(machine%stiffness), sums(:, 7)) + matmul(abs(machine%damping), sums(:, 8))
      end associate
   end subroutine integrate

   !> From the piece before displacements do not jump, and momentum by impulses alone.
   subroutine look_at_jump(self, part)
      type(balance_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp), dimension(size(self%root)) :: q, v

      call part%by%state(0.0_wp, q, v)
      call keep(self, 1, (q - self%z(:, 1))/self%root, self%reach/self%root)
      call keep_along(self, 2, self%unpushed, matmul(self%machine%mass, v - self%z(:, 2)), self%speed)
   end subroutine look_at_jump

   !> What is conserved of the momentum along motions that nothing but loads acts on, at `tau` s after the start of the piece: the
   !> same at the end of a motion as at its start.
   subroutine look_at_momentum(self, part, tau)
      type(balance_t), intent(inout) :: self
      type(piece_t), intent(in) :: part
      real(wp), intent(in) :: tau

      complex(wp) :: e
      real(wp), dimension(size(self%root)) :: q, v, momentum, terms
      integer :: t

      call part%by%state(tau, q, v)
      momentum = matmul(self%machine%mass, v) - (part%time + tau)*self%load(:, 1)%re
      terms = matmul(abs(self%machine%mass), abs(v))
      ! A motion that comes to rest has the sizes of its start.
      self%terms(2:4) = max(self%terms(2:4), maxval(self%root*terms)**[1, 2, 1])
      terms = terms + (part%time + tau)*abs(self%load(:, 1))
      do t = 1, size(self%machine%tone)
         associate (tone => self%machine%tone(t))
            if (tone%is_swept() .or. allocated(tone%waveform) .or. .not. tone%omega > 0.0_wp) return
            e = tone%excitation(part%time, part%time_low + tau)/tone%omega
            momentum = momentum - aimag(self%load(:, 1 + t)*e)
            terms = terms + abs(self%load(:, 1 + t)*e)
         end associate
      end do
      if (.not. allocated(self%conserved)) self%conserved = momentum
      call keep_along(self, 5, self%untouched, momentum - self%conserved, terms)
   end subroutine look_at_momentum

   !> Keep what is missing in momentum along motions (n, motions), and the size of its terms along all coordinates.
   pure subroutine keep_along(self, which, motion, missing, terms)
      type(balance_t), intent(inout) :: self
      integer, intent(in) :: which
      real(wp), intent(in) :: motion(:, :), missing(:), terms(:)

      call keep(self, which, matmul(missing, motion)/norm2(motion/spread(self%root, 2, size(motion, 2)), 1), self%root*terms)
   end subroutine keep_along

   !> Keep what is missing, and the size of its terms, if they are the largest so far.
   pure subroutine keep(self, which, missing, terms)
      type(balance_t), intent(inout) :: self
      integer, intent(in) :: which
      real(wp), intent(in) :: missing(:), terms(:)

      self%missing(which) = max(self%missing(which), maxval(abs(missing)))
      self%terms(which) = max(self%terms(which), maxval(terms))
   end subroutine keep

   !> The largest of what was missing, over the size of its terms in the motion; events `gave` what they may not of twice the
   !> kinetic energy, which was `most` before one.
   pure real(wp) function residual(self, gave, most)
      class(balance_t), intent(in) :: self
      real(wp), intent(in) :: gave, most

      associate (missing => [self%missing, gave], terms => [self%terms, max(self%terms(3), most)])
         residual = max(0.0_wp, maxval(missing/terms, mask=terms > 0.0_wp))
      end associate
   end function residual

end module razy_observe_balance
