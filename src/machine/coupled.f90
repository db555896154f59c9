!! The part of a machine that its contacts and observables can feel.
!!
!! In the coordinates x = Lᵀq, M = L Lᵀ, the equation is x'' + L⁻¹BL⁻ᵀ x' + L⁻¹KL⁻ᵀ x = L⁻¹f. The smallest subspace that
!! holds every contact direction L⁻¹w and observable and is mapped into itself by both matrices is found by a block Krylov
!! process; the motion in it does not depend on the rest. A symmetric gear pair, of four coordinates, has two such: its
!! common torsion touches neither teeth nor observable and is not propagated (Kalman's decomposition).
!! With gyroscopic or circulatory matrices the subspace is that of all coordinates which are coupled, by either matrix, with one
!! that is felt: what else is not felt is found in the modes (razy_exact_modal_observable_terms).
!! A direction is taken as already contained when what is left of it is below `dependent` times what entered.
!!
!! Where K and B are symmetric, what is orthogonal to the directions of contacts in this sense is mapped into itself as well: no
!! contact moves it and it moves none. What observables feel of it can be followed beside, so that what is observed chooses no
!! coordinate of the motion that contacts are in.
module razy_machine_coupled
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: identity, is_symmetric, lower_inverse
   use razy_linalg_lapack, only: dpotrf
   use razy_linalg_null_space, only: complement_of
   use razy_linalg_pattern, only: connected_sets, linked
   use razy_machine_by_speed, only: by_speed_t
   use razy_machine_machine, only: contact_rows, machine_t, mass_complaint, observe_linear
   implicit none(type, external)
   private

   public :: coupled_t, new_coupled

   !> y = S M q with y'' + B y' + K y = S f; linear forms on q are turned into such on y by S too.
   type :: coupled_t
      !> Number m of coordinates kept.
      integer :: m = 0
      !> S (m, n).
      real(wp), allocatable :: project(:, :)
      !> S M (m, n): y = to_coupled q.
      real(wp), allocatable :: to_coupled(:, :)
      !> B and K in these coordinates (m, m).
      real(wp), allocatable :: damping(:, :), stiffness(:, :)
      !> By what these change with the speed, where the machine has it.
      type(by_speed_t), allocatable :: by_speed
      !> L⁻¹ of M = L Lᵀ, and L⁻¹ K L⁻ᵀ (n, n).
      real(wp), allocatable, private :: inverse(:, :), sprung(:, :)
   end type coupled_t

   real(wp), parameter :: dependent = 1.0e-13_wp
   !> Smaller than this part of the largest entry, an entry is a rounding error.
   real(wp), parameter :: rounding = 1.0e-14_wp

contains

   !> Reduce `machine` to what is felt; `keep_all` keeps every coordinate (trajectories of the whole state). With `beside`, where
   !> contacts part the machine, `self` is what they feel, and all else that is felt is there. What is `linked` to what is felt,
   !> whether or not it is felt with these values, counts as felt: of machines whose values vary. M and K may be `as_before`.
   subroutine new_coupled(self, machine, keep_all, error, beside, linked, as_before)
      type(coupled_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error
      type(coupled_t), intent(out), optional :: beside
      logical, intent(in), optional :: linked, as_before

      real(wp), allocatable :: b(:, :), basis(:, :), factor(:, :), felt(:, :), rest(:, :)
      integer :: info, n
      logical :: by_value, known

      n = size(machine%mass, 1)
      known = .false.
      if (present(as_before)) known = as_before
      if (.not. known) then
         factor = machine%mass
         call dpotrf("L", n, factor, n, info)
         if (info /= 0) call raise(error, mass_complaint(machine, info))
         if (allocated(error)) return
         self%inverse = lower_inverse(factor)
         self%sprung = matmul(self%inverse, matmul(machine%stiffness, transpose(self%inverse)))
      end if
      if (allocated(self%by_speed)) deallocate (self%by_speed)
      b = matmul(self%inverse, matmul(machine%damping, transpose(self%inverse)))
      if (allocated(machine%by_speed)) self%by_speed = machine%by_speed%projected(transpose(self%inverse))
      felt = matmul(self%inverse, directions(machine))
      by_value = is_symmetric(self%sprung) .and. is_symmetric(b)
      if (present(beside) .and. size(machine%contact) > 0 .and. .not. allocated(self%by_speed) .and. by_value) then
         call invariant_subspace(self%sprung, b, felt(:, :size(machine%contact)), felt(:, :0), basis)
         if (keep_all) then
            rest = complement_of(basis)
         else
            call invariant_subspace(self%sprung, b, felt(:, size(machine%contact) + 1:), basis, rest)
         end if
         call project_machine(beside, machine, rest, self%inverse, self%sprung, b)
      else if (keep_all) then
         basis = identity(n)
      else if (allocated(self%by_speed)) then
         ! At some speed all is coupled that ever is.
         basis = felt_coordinates(abs(self%sprung) + self%by_speed%pattern(), b, felt)
      else
         if (present(linked)) by_value = by_value .and. .not. linked
         if (by_value) then
            call invariant_subspace(self%sprung, b, felt, felt(:, :0), basis)
            ! Where each form is that of one coordinate and all are felt, these couple the fewest: narrow bands stay so. A form of
            ! more is better kept as a direction of its own: what sticks rests to rounding of itself.
            if (size(basis, 2) == n .and. all(count(abs(felt) > 0.0_wp, dim=1) <= 1)) basis = identity(n)
         else
            basis = felt_coordinates(self%sprung, b, felt)
         end if
      end if
      call project_machine(self, machine, basis, self%inverse, self%sprung, b)
      if (allocated(self%by_speed)) self%by_speed = self%by_speed%projected(basis)
   end subroutine new_coupled

   !> The machine in the orthonormal `basis` (n, m) of x; `inverse` is L⁻¹, `k` and `b` (n, n) its matrices for x.
   pure subroutine project_machine(self, machine, basis, inverse, k, b)
      type(coupled_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: basis(:, :), inverse(:, :), k(:, :), b(:, :)

      integer :: kept(size(basis, 2))

      self%m = size(basis, 2)
      kept = maxloc(basis, dim=1)
      ! Coordinates that are chosen, not combined.
      if (all(count(abs(basis) > 0.0_wp, dim=1) == 1 .and. abs(maxval(basis, dim=1) - 1.0_wp) <= 0.0_wp)) then
         self%project = inverse(kept, :)
         self%stiffness = k(kept, kept)
         self%damping = b(kept, kept)
      else
         self%project = matmul(transpose(basis), inverse)
         self%stiffness = matmul(transpose(basis), matmul(k, basis))
         self%damping = matmul(transpose(basis), matmul(b, basis))
      end if
      self%to_coupled = matmul(self%project, machine%mass)
   end subroutine project_machine

   !> The linear forms that have to be followed: contact directions and observables, as columns.
   pure function directions(machine) result(columns)
      type(machine_t), intent(in) :: machine
      real(wp), allocatable :: columns(:, :)

      real(wp), allocatable :: rows(:, :)
      integer :: j, used

      rows = contact_rows(machine%contact)
      used = size(rows, 2)
      allocate (columns(size(machine%mass, 1), used + 2*size(machine%observable)), source=0.0_wp)
      if (used > 0) columns(:, :used) = rows
      do j = 1, size(machine%observable)
         if (machine%observable(j)%kind /= observe_linear) cycle
         columns(:, used + 1) = machine%observable(j)%on_displacement
         columns(:, used + 2) = machine%observable(j)%on_velocity
         used = used + 2
      end do
   end function directions

   !> The unit vectors of all coordinates that `k` and `b` couple with one in which a column of `start` is not zero.
   pure function felt_coordinates(k, b, start) result(basis)
      real(wp), intent(in) :: k(:, :), b(:, :), start(:, :)
      real(wp), allocatable :: basis(:, :)

      integer :: set(size(k, 1)), i
      logical :: felt(size(k, 1))

      set = connected_sets(linked(k, rounding) .or. linked(b, rounding))
      felt = any(abs(start) > 0.0_wp, dim=2)
      basis = identity(size(set))
      basis = basis(:, pack([(i, i=1, size(set))], [(any(felt .and. set == set(i)), i=1, size(set))]))
   end function felt_coordinates

   !> Orthonormal basis of what the smallest subspace that holds `start` and is invariant under kᵀ and bᵀ has beside `given`, which
   !> is invariant itself.
   pure subroutine invariant_subspace(k, b, start, given, basis)
      real(wp), intent(in) :: k(:, :), b(:, :), start(:, :), given(:, :)
      real(wp), allocatable, intent(out) :: basis(:, :)

      real(wp) :: q(size(k, 1), size(k, 1)), v(size(k, 1))
      integer :: i, done, m

      m = size(given, 2)
      q(:, :m) = given
      do i = 1, size(start, 2)
         call extend(q, m, start(:, i), abs(start(:, i)))
      end do
      done = size(given, 2)
      do while (done < m)
         done = done + 1
         v = q(:, done)
         call extend(q, m, matmul(v, k), matmul(abs(v), abs(k)))
         call extend(q, m, matmul(v, b), matmul(abs(v), abs(b)))
      end do
      basis = q(:, size(given, 2) + 1:m)
   end subroutine invariant_subspace

   !> Append to the first m columns of q what is new in v, if it is more than rounding of terms of size `scale`.
   pure subroutine extend(q, m, v, scale)
      real(wp), intent(inout) :: q(:, :)
      integer, intent(inout) :: m
      real(wp), intent(in) :: v(:), scale(:)

      real(wp) :: rest(size(v)), length
      integer :: pass

      if (m == size(q, 2)) return
      rest = v
      do pass = 1, 2
         rest = rest - matmul(q(:, :m), matmul(rest, q(:, :m)))
      end do
      length = norm2(rest)
      if (length <= dependent*norm2(scale)) return
      rest = rest/length
      rest = rest - matmul(q(:, :m), matmul(rest, q(:, :m)))
      m = m + 1
      q(:, m) = rest/norm2(rest)
   end subroutine extend

end module razy_machine_coupled
