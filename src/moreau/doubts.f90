!! Events in doubt in the steps of the Moreau–Jean scheme (razy_hybrid_cubic_doubts, razy_hybrid_defects).
!!
!! Displacements within a step are a parabola, so a gap is taken to be known to h |Δs'|/8, by which the parabola differs from its
!! chord. Counted are gaps that turn nearer than that to a bound, or beyond it, between ends on the same side; ends on opposite
!! sides of an open gap; and impacts that are slower than what the free motion adds to the velocity within the step: a touch of
!! which the step does not know whether there is one, or one of an accumulation. So is friction that sticks while its force turns
!! as near to its bound as its second difference lets it have come between means over steps.
!!
!! The scheme takes compliant forces at the end of a step; the mean of both ends is of second order. Their difference is the defect
!! (F⁺ - F)/2. Over a contact with a spring k, ω² = k wᵀM⁻¹w, which is touched with v, that makes a drift of h ω² max s = h ω v.
!! What the scheme loses is v (1 - (1 + h²ω²/2)^(-n/2)) = π/4 h ω v to first order, n = π/(h ω) being the steps in contact.
!! With θ > 1/2 the forces of the matrices have the defect (θ - 1/2) (K Δq + B Δv). A rigid contact closes up to h/2 too early or
!! too late.
module razy_moreau_doubts
   use razy_contact_contact_law, only: branch_sticking
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_hybrid_defects, only: defects_t
   use razy_hybrid_cubic_doubts, only: across, barely_passed, doubts_t, samples_t, turned_near
   use razy_moreau_state, only: moreau_step_t
   use razy_linalg_lapack, only: dposv
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: moreau_doubts_t

   type, extends(doubts_t) :: moreau_doubts_t
      type(defects_t), private :: defects
      !> Room that friction which sticks has up to its bound, N (friction elements).
      type(samples_t), private :: room
      !> M⁻¹ W (n, contacts) and WᵀM⁻¹W (contacts, contacts); time of the last impact of each rigid contact, s (contacts).
      real(wp), allocatable, private :: response(:, :), delassus(:, :), since(:)
   contains
      procedure :: attach
      procedure :: begin
      procedure :: of_step
   end type moreau_doubts_t

contains

   !> Take a machine.
   subroutine attach(self, machine, error)
      class(moreau_doubts_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: mass(:, :), w(:, :)
      integer :: info, j, n

      n = size(machine%mass, 1)
      allocate (w(n, size(machine%contact)))
      do j = 1, size(machine%contact)
         w(:, j) = machine%contact(j)%w
      end do
      mass = machine%mass
      self%response = w
      call dposv("L", n, size(machine%contact), mass, n, self%response, n, info)
      if (info /= 0) call raise(error, "the mass matrix is not positive definite")
      self%delassus = matmul(transpose(w), self%response)
   end subroutine attach

   !> None yet; the steps of the motion have begun.
   pure subroutine begin(self, step)
      class(moreau_doubts_t), intent(inout) :: self
      type(moreau_step_t), intent(in) :: step

      self%count = 0
      self%first = 0.0_wp
      call self%defects%begin(size(self%delassus, 1))
      call self%room%begin(size(step%kinds%friction))
      if (allocated(self%since)) deallocate (self%since)
      allocate (self%since(size(self%delassus, 1)), source=0.0_wp)
   end subroutine begin

   !> Count the doubts of the last step, which started at `time`, s.
   subroutine of_step(self, step, time)
      class(moreau_doubts_t), intent(inout) :: self
      type(moreau_step_t), intent(in) :: step
      real(wp), intent(in) :: time

      integer :: i, j
      logical :: doubtful

      call gather_defects(self, step)
      do j = 1, size(step%machine%contact)
         associate (law => step%machine%contact(j)%law)
            if (law%of_normal) cycle
            doubtful = .false.
            if (step%branch0(j) == step%branch1(j)) then
               doubtful = turned(step, j)
            else if (.not. law%impacts) then
               call pass(self, step, j, doubtful)
               doubtful = doubtful .or. across(step%branch0(j), step%branch1(j))
            end if
            if (doubtful) call self%add(time)
         end associate
      end do
      do i = 1, step%work%count
         associate (side => step%kinds%side(step%work%active(i)))
            j = side%contact
            if (step%branch1(j) /= side%closed .or. step%branch0(j) == side%closed) cycle
            call touch(self, step, i, j, time, doubtful)
            if (doubtful) call self%add(time)
         end associate
      end do
      call look_at_friction(self, step, time)
   end subroutine of_step

   !> Friction that sticks is in doubt where its force comes as near to its bound as it may have come within a step.
   pure subroutine look_at_friction(self, step, time)
      type(moreau_doubts_t), intent(inout) :: self
      type(moreau_step_t), intent(in) :: step
      real(wp), intent(in) :: time

      real(wp) :: lowest, room
      integer :: i
      logical :: turned

      do i = 1, size(step%kinds%friction)
         associate (j => step%kinds%friction(i))
            if (step%branch1(j) /= branch_sticking .or. .not. step%bound(j) > 0.0_wp) then
               call self%room%forget(i)
               cycle
            end if
            call self%room%next(i, time + 0.5_wp*step%h, (step%bound(j) - abs(step%impulse(j)))/step%h, turned, lowest, room)
            if (turned .and. lowest <= room) call self%add(time)
         end associate
      end do
   end subroutine look_at_friction

   !> Add up the defects of the forces in the step.
   subroutine gather_defects(self, step)
      type(moreau_doubts_t), intent(inout) :: self
      type(moreau_step_t), intent(in) :: step

      real(wp) :: defect(size(step%branch0))
      integer :: i, j

      defect = 0.0_wp
      do i = 1, size(step%kinds%compliant)
         j = step%kinds%compliant(i)
         if (.not. abs(step%force1(j) - step%force0(j)) > 0.0_wp) cycle
         defect = defect + 0.5_wp*(step%force1(j) - step%force0(j))*self%delassus(:, j)
      end do
      if (step%theta > 0.5_wp) then
         defect = defect + (step%theta - 0.5_wp)*matmul(matmul(step%machine%stiffness, step%q1 - step%q0) &
                                                        + matmul(step%machine%damping, step%v1 - step%v0), self%response)
      end if
      call self%defects%gather(step%h, abs(defect))
   end subroutine gather_defects

   !> A bound of compliant contact j was passed in the step.
   subroutine pass(self, step, j, doubtful)
      type(moreau_doubts_t), intent(inout) :: self
      type(moreau_step_t), intent(in) :: step
      integer, intent(in) :: j
      logical, intent(out) :: doubtful

      real(wp) :: direction, known, rate(2), second
      logical :: barely

      rate = rates(step, j)
      known = step%h*abs(rate(2) - rate(1))/8 + self%defects%way(j)
      ! What s'' would be without the force that the contact has come to.
      second = (rate(2) - rate(1))/step%h + self%delassus(j, j)*(step%force1(j) - step%force0(j))
      direction = sign(1.0_wp, dot_product(step%w(:, j), step%q1 - step%q0) + (step%finish%s(j) - step%start%s(j)))
      barely = barely_passed(direction, direction*rate(1) - self%defects%drift(j), second, known)
      call self%defects%pass(j, rate(2), .true., doubtful)
      doubtful = doubtful .or. barely
   end subroutine pass

   !> s' of contact j at both ends of the step.
   pure function rates(step, j)
      type(moreau_step_t), intent(in) :: step
      integer, intent(in) :: j
      real(wp) :: rates(2)

      rates = [dot_product(step%w(:, j), step%v0) + step%start%rate(j), dot_product(step%w(:, j), step%v1) + step%finish%rate(j)]
   end function rates

   !> An impact of active side i, of contact j, in the step.
   subroutine touch(self, step, i, j, time, doubtful)
      type(moreau_doubts_t), intent(inout) :: self
      type(moreau_step_t), intent(in) :: step
      integer, intent(in) :: i, j
      real(wp), intent(in) :: time
      logical, intent(out) :: doubtful

      real(wp) :: now

      now = time + step%h
      self%defects%shift(j) = self%defects%shift(j) + 0.5_wp*step%h/max(now - self%since(j), step%h)
      self%since(j) = now
      call self%defects%pass(j, step%work%problem%before(i), .true., doubtful)
      doubtful = doubtful .or. abs(step%work%problem%before(i)) < abs(step%work%free(j))
   end subroutine touch

   !> Whether s of contact j turns near a bound of its branch.
   pure function turned(step, j)
      type(moreau_step_t), intent(in) :: step
      integer, intent(in) :: j
      logical :: turned

      real(wp) :: rate(2), s(2)

      rate = rates(step, j)
      turned = .false.
      if (.not. rate(1)*rate(2) < 0.0_wp) return
      s = [dot_product(step%w(:, j), step%q0) + step%start%s(j), dot_product(step%w(:, j), step%q1) + step%finish%s(j)]
      turned = turned_near(step%machine%contact(j)%law, step%branch0(j), step%h, s, rate, step%h*abs(rate(2) - rate(1))/8)
   end function turned

end module razy_moreau_doubts
